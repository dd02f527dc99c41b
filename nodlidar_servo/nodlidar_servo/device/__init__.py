"""One servo: parameters, preparation, measurements and their time."""
