"""The command line: arguments, tables, exit codes, nothing else."""
