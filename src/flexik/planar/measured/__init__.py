"""A measured machine: campaign, error budget, identification and adaptation."""
