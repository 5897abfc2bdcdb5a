"""What people use: commands, report, delivery, campaign, linearisation, design of experiments, the paper's tables."""
