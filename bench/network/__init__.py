"""Several machines: bandwidth, lost packets, discovery."""
