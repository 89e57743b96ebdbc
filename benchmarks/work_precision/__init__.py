"""Error against run time of full and reduced models, setting by setting."""
