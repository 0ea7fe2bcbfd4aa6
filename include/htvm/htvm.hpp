// htvm: compression of human time-varying meshes. This header brings the whole C++ API, and needs nothing but the
// standard library and tl/expected.hpp.
//
// htvm::decoder and htvm::encoder have what it declares, except for: Publisher and Watcher, in htvm::live
// (publisher.hpp, watcher.hpp); PictureEncoder, PictureDecoder, OwnPlanes and image_of(), in htvm::texture
// (picture_*.hpp); draco_intra_coder(), in htvm::draco (intra_coder.hpp). These link other libraries.
#pragma once

#include "htvm/audio.hpp"            // IWYU pragma: export
#include "htvm/decoder.hpp"          // IWYU pragma: export
#include "htvm/dependency.hpp"       // IWYU pragma: export
#include "htvm/encoder.hpp"          // IWYU pragma: export
#include "htvm/encoder_options.hpp"  // IWYU pragma: export
#include "htvm/frame.hpp"            // IWYU pragma: export
#include "htvm/frame_numbers.hpp"    // IWYU pragma: export
#include "htvm/image.hpp"            // IWYU pragma: export
#include "htvm/intra_coder.hpp"      // IWYU pragma: export
#include "htvm/lattice_mesh.hpp"     // IWYU pragma: export
#include "htvm/mesh.hpp"             // IWYU pragma: export
#include "htvm/option_list.hpp"      // IWYU pragma: export
#include "htvm/packet.hpp"           // IWYU pragma: export
#include "htvm/picture_decoder.hpp"  // IWYU pragma: export
#include "htvm/picture_encoder.hpp"  // IWYU pragma: export
#include "htvm/picture_planes.hpp"   // IWYU pragma: export
#include "htvm/publisher.hpp"        // IWYU pragma: export
#include "htvm/result.hpp"           // IWYU pragma: export
#include "htvm/running_time.hpp"     // IWYU pragma: export
#include "htvm/scene.hpp"            // IWYU pragma: export
#include "htvm/skeleton.hpp"         // IWYU pragma: export
#include "htvm/stage_time.hpp"       // IWYU pragma: export
#include "htvm/stream_index.hpp"     // IWYU pragma: export
#include "htvm/texture.hpp"          // IWYU pragma: export
#include "htvm/texture_layout.hpp"   // IWYU pragma: export
#include "htvm/threads.hpp"          // IWYU pragma: export
#include "htvm/watcher.hpp"          // IWYU pragma: export
