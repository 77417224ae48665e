"""The elastic two-link arm of Al-Khafaji and Jweeg 2017."""
