"""How far apart measurement and simulation are: noise floors, channels, bands, time, regimes, distortion."""
