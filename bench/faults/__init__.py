"""The launched system while parts of it fail."""
