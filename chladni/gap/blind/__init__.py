"""The withheld check: cases whose cause is sealed before the diagnosis runs."""
