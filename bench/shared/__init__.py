"""What the measurements share: recording, pages, the reference set-up, timing."""
