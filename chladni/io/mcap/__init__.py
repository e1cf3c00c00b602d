"""The MCAP container: channels, and messages as columns of still encoded bytes."""
