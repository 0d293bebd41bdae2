/* A host with an Embree of its own in its global scope: none of our calls may land there. Every rtc
 * function below ends the program; it is linked with -export-dynamic. */
#include "abi/plain.h"

#define FAKE(name)                                                                                 \
    void name(void);                                                                               \
    void name(void) {                                                                              \
        fputs("the host's own " #name " was called\n", stderr);                                    \
        _Exit(1);                                                                                  \
    }                                                                                              \
    void name(void)

FAKE(rtcNewDevice);
FAKE(rtcRetainDevice);
FAKE(rtcReleaseDevice);
FAKE(rtcGetDeviceProperty);
FAKE(rtcSetDeviceProperty);
FAKE(rtcGetDeviceError);
FAKE(rtcSetDeviceErrorFunction);
FAKE(rtcSetDeviceMemoryMonitorFunction);
FAKE(rtcNewScene);
FAKE(rtcRetainScene);
FAKE(rtcReleaseScene);
FAKE(rtcGetSceneDevice);
FAKE(rtcAttachGeometry);
FAKE(rtcAttachGeometryByID);
FAKE(rtcDetachGeometry);
FAKE(rtcGetGeometry);
FAKE(rtcGetGeometryThreadSafe);
FAKE(rtcCommitScene);
FAKE(rtcJoinCommitScene);
FAKE(rtcSetSceneProgressMonitorFunction);
FAKE(rtcSetSceneBuildQuality);
FAKE(rtcSetSceneFlags);
FAKE(rtcGetSceneFlags);
FAKE(rtcGetSceneBounds);
FAKE(rtcIntersect1);
FAKE(rtcIntersect4);
FAKE(rtcIntersect8);
FAKE(rtcIntersect16);
FAKE(rtcIntersect1M);
FAKE(rtcOccluded1);
FAKE(rtcOccluded4);
FAKE(rtcOccluded8);
FAKE(rtcOccluded16);
FAKE(rtcOccluded1M);
FAKE(rtcPointQuery);
FAKE(rtcNewGeometry);
FAKE(rtcRetainGeometry);
FAKE(rtcReleaseGeometry);
FAKE(rtcCommitGeometry);
FAKE(rtcEnableGeometry);
FAKE(rtcDisableGeometry);
FAKE(rtcSetGeometryMask);
FAKE(rtcSetGeometryBuildQuality);
FAKE(rtcSetGeometryBuffer);
FAKE(rtcSetSharedGeometryBuffer);
FAKE(rtcSetNewGeometryBuffer);
FAKE(rtcGetGeometryBufferData);
FAKE(rtcUpdateGeometryBuffer);
FAKE(rtcSetGeometryUserData);
FAKE(rtcGetGeometryUserData);
FAKE(rtcSetGeometryOccludedFilterFunction);
FAKE(rtcSetGeometryIntersectFilterFunction);
FAKE(rtcSetGeometryVertexAttributeCount);
FAKE(rtcNewBuffer);
FAKE(rtcNewSharedBuffer);
FAKE(rtcReleaseBuffer);
FAKE(rtcNewBVH);
FAKE(rtcReleaseBVH);

int main(void) {
    static const plain_api api = PLAIN_LINKED;
    static float v[PLAIN_POINTS];
    const char *names[64];
    const unsigned n = plain_methods(&api, names);
    for (unsigned i = 0; i < n; i++) {
        plain_run(&api, names[i], v);
        plain_plausible(v, names[i]);
    }
    puts("the host's Embree was left alone");
    return 0;
}
