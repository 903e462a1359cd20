import sys

import swarmfit

cloud = swarmfit.read_cloud(sys.argv[1])
result = swarmfit.fit(cloud, "plane", threshold=0.02)
for plane in result.models:
    print(plane.normal, plane.offset, plane.inliers, "points")
print((result.labels == 0).sum(), "points on none of them")
