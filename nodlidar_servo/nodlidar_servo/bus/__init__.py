"""The bus: packets, replies, and how long to wait for them."""
