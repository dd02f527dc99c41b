"""Grid, surfaces, picture and files of a map."""
