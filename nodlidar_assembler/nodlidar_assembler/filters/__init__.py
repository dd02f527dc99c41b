"""What scans wait for, in the manner of message_filters, and the way from them to clouds."""
