"""Camera images -> poses of the objects on the table, and a virtual camera that draws such images.

`camera.py` and `fiducials.py` say where a pixel lies on the table, `blobs.py` finds objects by colour, `rim.py`
measures their centres on the circle of their rim, `motion.py` and `association.py` keep identities, `tracker.py` joins
the steps for one image and `video.py` for many. `scene.py`, `arm.py` and `virtual_camera.py` draw.
"""
