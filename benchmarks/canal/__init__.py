"""Registration of sonar scans in canal tunnels: against truth, on scenes of `tunneldb.simulate.canal`, beside peers."""
