"""New assets, foreign assets, and what a diagnosis writes back into an asset."""
