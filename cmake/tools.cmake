# The libraries that the programs use besides the codec.
find_package(nlohmann_json 3.10 REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(PNG REQUIRED)
find_path(TURBOJPEG_INCLUDE turbojpeg.h REQUIRED)
find_library(TURBOJPEG_LIBRARY turbojpeg REQUIRED)
find_path(WEBP_INCLUDE webp/decode.h REQUIRED)
find_library(WEBP_LIBRARY webp REQUIRED)
add_library(htvm_image_formats INTERFACE)
target_include_directories(htvm_image_formats SYSTEM INTERFACE ${TURBOJPEG_INCLUDE} ${WEBP_INCLUDE})
target_link_libraries(htvm_image_formats INTERFACE PNG::PNG ${TURBOJPEG_LIBRARY} ${WEBP_LIBRARY})
find_package(embree 3 REQUIRED)
find_path(DRACO_INCLUDE draco/compression/encode.h REQUIRED)
find_library(DRACO_LIBRARY draco REQUIRED)
add_library(htvm_libdraco INTERFACE)
target_include_directories(htvm_libdraco SYSTEM INTERFACE ${DRACO_INCLUDE})
target_link_libraries(htvm_libdraco INTERFACE ${DRACO_LIBRARY})

# Images and textures are apart, so that the Python library, which reads meshes alone, needs none of their libraries.
file(GLOB io_sources CONFIGURE_DEPENDS src/io/*.cpp)
set(image_sources ${io_sources})
list(FILTER image_sources INCLUDE REGEX "/(image|texture)_[a-z]*\\.cpp$")
list(FILTER io_sources EXCLUDE REGEX "/(image|texture)_[a-z]*\\.cpp$")
htvm_floor(io SOURCES ${io_sources} LINKS htvm_core htvm_libdraco nlohmann_json::nlohmann_json)
htvm_floor(images SOURCES ${image_sources} LINKS htvm_io htvm_image_formats)
# Sound, likewise.
find_package(PkgConfig REQUIRED)
pkg_check_modules(HTVM_SOUND_FORMATS REQUIRED IMPORTED_TARGET opus sndfile samplerate)
htvm_floor(sound DIRECTORY src/sound LINKS htvm_decoder htvm_io PkgConfig::HTVM_SOUND_FORMATS)
htvm_floor(synth DIRECTORY src/synth LINKS htvm_core Eigen3::Eigen)
# It reads no input, and makes what other tests need: with sanitizers it would take half of their time.
if(HTVM_SANITIZE MATCHES "address")
  target_compile_options(htvm_synth PRIVATE -fno-sanitize=all -O2)
endif()
# Above the encoder's surface: pictures of a capture's texture in the layout of a stream's charts.
htvm_floor(texture_baking SOURCES src/texture/texture_baking.cpp src/texture/surface_matches.cpp LINKS htvm_core htvm_surface)
htvm_floor(metrics DIRECTORY src/metrics LINKS htvm_core Eigen3::Eigen embree PNG::PNG)

# Draco-coded I-frames: plugs into the encoder and the decoder, which do not depend on libdraco.
file(GLOB draco_sources CONFIGURE_DEPENDS src/codec/draco/*.cpp)
htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder htvm_libdraco)
htvm_library(draco FLOORS draco LINKS decoder NEEDS $<BUILD_INTERFACE:${DRACO_LIBRARY}> $<INSTALL_INTERFACE:htvm::libdraco>)

# The pictures of textures as video, and back: a library of its own, as the decoder needs none of these.
find_package(PkgConfig REQUIRED)
pkg_check_modules(HTVM_VIDEO REQUIRED IMPORTED_TARGET aom vpx dav1d)
file(GLOB picture_sources CONFIGURE_DEPENDS src/texture/picture_*.cpp src/texture/vp9_*.cpp)
htvm_floor(texture SOURCES ${picture_sources} LINKS htvm_decoder PkgConfig::HTVM_VIDEO)
htvm_library(texture FLOORS texture LINKS decoder NEEDS $<BUILD_INTERFACE:PkgConfig::HTVM_VIDEO> $<INSTALL_INTERFACE:htvm::video>)

# The programs: everything but their main.cpp is a library, so that tests reach it. htvm_app is what users run,
# htvm_laboratory what experiments need; both use htvm_command_line.
function(htvm_program_library name folder)
  file(GLOB sources CONFIGURE_DEPENDS apps/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  add_library(htvm_${name} STATIC ${sources})
  target_include_directories(htvm_${name} PUBLIC apps apps/${folder})
  target_link_libraries(htvm_${name} PUBLIC ${ARGN})
  htvm_precompile(htvm_${name} <CLI/CLI.hpp> <fmt/core.h> <nlohmann/json.hpp> <filesystem> <string> <vector>)
  # The work is in the libraries; optimising the options and tables would take a quarter of the whole build.
  target_compile_options(htvm_${name} PRIVATE $<IF:$<CONFIG:Debug>,-O0,-O1>)
endfunction()
htvm_program_library(command_line command_line htvm_core htvm_io htvm_images htvm_metrics CLI11::CLI11 fmt::fmt nlohmann_json::nlohmann_json)
target_compile_definitions(htvm_command_line PUBLIC HTVM_VERSION="${PROJECT_VERSION}")
include(cmake/live.cmake)
htvm_program_library(app htvm htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_sound htvm_texture htvm_texture_baking htvm_synth htvm_metrics htvm_live)
htvm_program_library(laboratory lab htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_texture htvm_texture_baking htvm_synth htvm_metrics)
add_executable(htvm apps/htvm/main.cpp)
target_link_libraries(htvm PRIVATE htvm_app)
add_executable(htvm-lab apps/lab/main.cpp)
target_link_libraries(htvm-lab PRIVATE htvm_laboratory)
