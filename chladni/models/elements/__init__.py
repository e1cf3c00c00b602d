"""Elementary transfer functions and corrections: P to PID, dead time, electrical and mechanical networks."""
