"""Codes of what an inverse found, one a row; all mechanisms share them."""

REACHED, OUT_OF_REACH, ACTUATOR_LIMIT = 0, 1, 2
STATUS_MEANING = {
    REACHED: "reached",
    OUT_OF_REACH: "farther or nearer than the links allow",
    ACTUATOR_LIMIT: "needs an actuator beyond its limit",
}
