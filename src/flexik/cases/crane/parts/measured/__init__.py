"""The measured crane: campaign, error budget, identification and adaptation."""
