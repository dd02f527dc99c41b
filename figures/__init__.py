"""The figures of the publication that the sensor comes from, computed anew."""
