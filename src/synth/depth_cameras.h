// The synthetic person as depth cameras deliver it: each camera's depth image of the whole body's surface, with the
// sensor's errors, and the sheet of triangles that joins neighbouring pixels without a step between them. Any frame can
// be made on its own, and is the same for any number of threads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "synth/depth_sensor.h"
#include "synth/synth.h"

namespace htvm {

struct DepthCameraOptions {
    int cameras = 1;  // 1 to 16, evenly spaced around the person, the first one in front: 1 sees the front, 2 front and
                      // back, whose sheets hardly overlap, 3 and more the whole person, some of it twice
    DepthSensor sensor = DepthSensor::kinect;
    double distance =
        0;             // mm from the middle of what happens (kinect), from the face (phone); 0: see camera_distance()
    int vertices = 0;  // about so many a frame in all sheets together, by the number of pixels; 0: as many as the
                       // sensor's own pixels make
    double noise = 1;  // share of the sensor's own noise, lost and flying pixels, 0 to 4; 0: an exact camera
};

// Where a camera is and what its image is like: without distortion, its middle in the middle.
struct DepthCamera {
    Eigen::Vector3d position;             // mm
    Eigen::Vector3d right, up, backward;  // unit vectors; the camera looks along -backward
    int width = 0, height = 0;            // pixels
    double focal = 0;                     // pixels
};

struct DepthCapture {
    Mesh mesh;                          // sheet after sheet, without a vertex in common; every vertex has a triangle.
                                        // Colours, and normals if the frame has them
    std::vector<std::uint32_t> sheets;  // the number of vertices of each camera's sheet
    std::vector<DepthCamera> cameras;
    std::vector<std::uint8_t> seen;  // for each triangle of the frame's mesh: 1 if a camera's image shows it
};

// Fails (bad_input) with what is wrong with the options, if anything.
Result<void> check_depth_cameras(const DepthCameraOptions& options);

// mm: the option, or where it is 0 what suits sensor and motion: a phone is held at 0.6 m, a Kinect stands at 2.5 m,
// and at 3 m where people walk about.
double camera_distance(const SynthOptions& options, const DepthCameraOptions& cameras);

// How many vertices the frame's mesh needs at least to be no coarser than what the cameras tell.
int body_vertices(const DepthCameraOptions& options);

// The cameras in a frame. A Kinect stands still, at chest height. A phone is held before the (first) person's face, and
// goes along with it. What comes nearer to it than 0.2 m, or a Kinect than 0.5 m, is not captured.
std::vector<DepthCamera> depth_cameras(const SynthOptions& options, const DepthCameraOptions& cameras, int frame);

// Neighbouring pixels are joined if their depths differ by at most this, mm: a step that a surface makes which is
// turned away by 74 degrees, and three deviations of the noise.
double step_limit(const DepthCamera& camera, const DepthCameraOptions& options, double depth);

// For a frame of synth_frame() with the same options and number; its mesh is seen without its noise.
DepthCapture capture_depth(const SynthOptions& options, const DepthCameraOptions& cameras, const SynthFrame& made,
                           int frame, internal::Threads threads = {});

// The triangles of a frame's mesh that DepthCapture::seen names, without its noise: what of the true surface the
// cameras could see, an open mesh.
Mesh seen_surface(const SynthFrame& made, const DepthCapture& capture);

}  // namespace htvm
