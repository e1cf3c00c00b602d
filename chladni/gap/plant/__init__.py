"""A model beside a measurement: free simulation, and linear responses on the lines of a record."""
