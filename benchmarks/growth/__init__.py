"""A survey among a thousand others: what it costs in a national operator's database against what it costs by itself."""
