#include "synth/scene.h"

#include <algorithm>

namespace htvm::synth {

PosedScene scene_of(const PosedBody& body) {
    PosedScene scene;
    std::ranges::copy(body.parts, scene.parts.begin());
    scene.joints = body.joints;
    scene.landmarks.assign(body.joints.begin(), body.joints.end());
    return scene;
}

PosedScene rest_scene() {
    PosedScene scene;  // every frame is the identity
    scene.joints = rest_joints();
    scene.landmarks.assign(scene.joints.begin(), scene.joints.end());
    return scene;
}

}  // namespace htvm::synth
