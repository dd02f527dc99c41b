"""Signs that inputs are wrong although each message is valid; diagnostics warn of them."""
