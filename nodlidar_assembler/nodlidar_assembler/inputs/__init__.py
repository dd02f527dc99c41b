"""Messages, from rclpy or a bag, as checked values: scans and joint samples."""
