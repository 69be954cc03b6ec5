"""New assets, foreign assets, and what a diagnosis writes back into an asset.

`foreign_file` reads URDF and MJCF, `foreign_plan` makes an asset of them, and its joints' drives
are in `imported_asset/tendon.usda.jinja`. `asset_plan` and `direct_plan` are new assets,
`mujoco_file` writes MJCF.
"""
