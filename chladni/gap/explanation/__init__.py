"""Which effect it is: screened on the recovered force, fitted in free run, weighed by held-out evidence."""
