"""Files written while a script runs: state logs, command logs, videos."""
