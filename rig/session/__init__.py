"""Robot and rings heard at once: gathered, recorded, and watched for what asks for a stop."""
