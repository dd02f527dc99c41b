"""Messages, rclpy's or those of a bag, as checked values: scans, joint samples."""
