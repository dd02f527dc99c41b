"""The protocol SCIP 2.0: port, session, answers, ranges, and the account of the scans."""
