# The libraries that the programs use besides the codec.
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

file(GLOB image_sources CONFIGURE_DEPENDS src/io/image_*.cpp src/io/texture_*.cpp src/io/child_program.cpp)
htvm_floor(images SOURCES ${image_sources} LINKS htvm_io htvm_image_formats)
# Sound, likewise.
find_package(PkgConfig REQUIRED)
pkg_check_modules(HTVM_SOUND_FORMATS REQUIRED IMPORTED_TARGET opus sndfile samplerate)
htvm_floor(sound DIRECTORY src/sound LINKS htvm_decoder htvm_io PkgConfig::HTVM_SOUND_FORMATS)
# Streams in .mp4 files and in segments for HTTP.
htvm_floor(container DIRECTORY src/container LINKS htvm_decoder)
# Above the encoder's surface: pictures of a capture's texture in the layout of a stream's charts.
htvm_floor(texture_baking SOURCES src/texture/texture_baking.cpp src/texture/surface_matches.cpp
  src/texture/film_picture.cpp LINKS htvm_core htvm_surface)
htvm_floor(metrics DIRECTORY src/metrics LINKS htvm_core Eigen3::Eigen htvm_nanoflann embree PNG::PNG)

# Draco-coded I-frames: plugs into the encoder and the decoder, which do not depend on libdraco.
file(GLOB draco_sources CONFIGURE_DEPENDS src/codec/draco/*.cpp)
htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder htvm_libdraco)
htvm_library(draco FLOORS draco LINKS decoder NEEDS $<BUILD_INTERFACE:${DRACO_LIBRARY}> $<INSTALL_INTERFACE:htvm::libdraco>)

# The pictures of textures as video, and back: a library of its own, as the decoder needs none of these.
find_package(PkgConfig REQUIRED)
pkg_check_modules(HTVM_VIDEO REQUIRED IMPORTED_TARGET aom vpx dav1d "SvtAv1Enc>=1.4" "SvtAv1Enc<3")
file(GLOB picture_sources CONFIGURE_DEPENDS src/texture/picture_*.cpp src/texture/vp9_*.cpp src/texture/foreseeing_*.cpp
  src/texture/thread_*.cpp)
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
htvm_program_library(command_line command_line htvm_core htvm_io htvm_images htvm_metrics htvm_texture_baking CLI11::CLI11 fmt::fmt nlohmann_json::nlohmann_json)
target_compile_definitions(htvm_command_line PUBLIC HTVM_VERSION="${PROJECT_VERSION}")
include(cmake/embed.cmake)
include(cmake/live.cmake)
htvm_program_library(app htvm htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_sound htvm_texture htvm_texture_baking htvm_synth htvm_metrics htvm_live htvm_container)
# The stream of `htvm demo`: apps/htvm/demo/make.sh made it.
set(demo_stream ${PROJECT_SOURCE_DIR}/apps/htvm/demo/person.htvm)
set(demo_cpp ${PROJECT_BINARY_DIR}/demo/demo_stream.cpp)
htvm_embed(demo_blob demo_person ${demo_stream})
file(CONFIGURE OUTPUT ${demo_cpp} CONTENT "// Written by cmake/tools.cmake.
#include \"demo_stream.h\"

@demo_blob@
namespace htvm::app {

std::span<const std::uint8_t> demo_stream() {
    return {reinterpret_cast<const std::uint8_t*>(demo_person), static_cast<std::size_t>(demo_person_end - demo_person)};
}

}  // namespace htvm::app
" @ONLY)
set_source_files_properties(${demo_cpp} PROPERTIES OBJECT_DEPENDS ${demo_stream})
target_sources(htvm_app PRIVATE ${demo_cpp})
htvm_program_library(laboratory lab htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_texture htvm_texture_baking htvm_synth htvm_metrics)
add_executable(htvm apps/htvm/main.cpp)
target_link_libraries(htvm PRIVATE htvm_app)
add_executable(htvm-lab apps/lab/main.cpp)
target_link_libraries(htvm-lab PRIVATE htvm_laboratory)
