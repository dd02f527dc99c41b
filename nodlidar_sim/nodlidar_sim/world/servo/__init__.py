"""A servo by physics: motor, gear, firmware and encoder, at a fixed step."""
