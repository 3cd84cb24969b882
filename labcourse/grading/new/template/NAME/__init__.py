"""The laboratory of an oven: what students get."""
