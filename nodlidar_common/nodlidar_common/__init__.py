"""What several nodlidar packages share."""
