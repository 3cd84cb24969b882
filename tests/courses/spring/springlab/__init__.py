"""The laboratory of a mass on a spring: what students get."""
