"""Reference solutions and published tables that runs are compared with, independent of jaxsph."""
