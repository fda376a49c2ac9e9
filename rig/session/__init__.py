"""Listen to robot and rings together: collect, record, and watch for stop conditions."""
