# The libraries that the programs use besides the codec.
if(WIN32)
  # Windows 10: what its headers declare; and none of their macros that get in the way.
  add_compile_definitions(_WIN32_WINNT=0x0A00 NOMINMAX WIN32_LEAN_AND_MEAN)
endif()
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)

# Images.
file(GLOB image_sources CONFIGURE_DEPENDS src/io/image_*.cpp src/io/texture_*.cpp src/io/child_program.cpp)
htvm_stand_in(image_sources IMAGES "(image_files|texture_video)_absent" "image_(png|jpeg|webp)|texture_video")
if(WIN32)
  list(FILTER image_sources EXCLUDE REGEX "/child_program\\.cpp$")
endif()
add_library(htvm_image_formats INTERFACE)
if(HTVM_IMAGES)
  find_package(PNG REQUIRED)
  find_path(TURBOJPEG_INCLUDE turbojpeg.h REQUIRED)
  find_library(TURBOJPEG_LIBRARY turbojpeg REQUIRED)
  find_path(WEBP_INCLUDE webp/decode.h REQUIRED)
  find_library(WEBP_LIBRARY webp REQUIRED)
  target_include_directories(htvm_image_formats SYSTEM INTERFACE ${TURBOJPEG_INCLUDE} ${WEBP_INCLUDE})
  target_link_libraries(htvm_image_formats INTERFACE PNG::PNG ${TURBOJPEG_LIBRARY} ${WEBP_LIBRARY})
endif()
htvm_floor(images SOURCES ${image_sources} LINKS htvm_io htvm_image_formats)
# Sound, likewise.
file(GLOB sound_sources CONFIGURE_DEPENDS src/sound/*.cpp)
htvm_stand_in(sound_sources SOUND sound_absent "opus_track|sound_file|stream_sound")
set(sound_needs "")
if(HTVM_SOUND)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(HTVM_SOUND_FORMATS REQUIRED IMPORTED_TARGET opus sndfile samplerate)
  set(sound_needs PkgConfig::HTVM_SOUND_FORMATS)
endif()
htvm_floor(sound SOURCES ${sound_sources} LINKS htvm_decoder htvm_io ${sound_needs})
# Streams in .mp4 files and in segments for HTTP.
htvm_floor(container DIRECTORY src/container LINKS htvm_decoder)
# Above the encoder's surface: pictures of a capture's texture in the layout of a stream's charts.
htvm_floor(texture_baking SOURCES src/texture/texture_baking.cpp src/texture/surface_matches.cpp
  src/texture/film_picture.cpp LINKS htvm_core htvm_surface)
file(GLOB metrics_sources CONFIGURE_DEPENDS src/metrics/*.cpp)
htvm_stand_in(metrics_sources IMAGES picture_png_absent picture_png)
htvm_stand_in(metrics_sources EMBREE triangle_index_own triangle_index)
set(metrics_needs "")
if(HTVM_IMAGES)
  list(APPEND metrics_needs PNG::PNG)
endif()
if(HTVM_EMBREE)
  find_package(embree 3 REQUIRED)
  list(APPEND metrics_needs embree)
endif()
htvm_floor(metrics SOURCES ${metrics_sources} LINKS htvm_core Eigen3::Eigen htvm_nanoflann ${metrics_needs})

# Draco-coded I-frames: plugs into the encoder and the decoder, which do not depend on libdraco.
file(GLOB draco_sources CONFIGURE_DEPENDS src/codec/draco/*.cpp)
htvm_stand_in(draco_sources DRACO intra_draco_absent intra_draco)
if(HTVM_DRACO)
  htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder htvm_libdraco)
  htvm_library(draco FLOORS draco LINKS decoder NEEDS $<BUILD_INTERFACE:${DRACO_LIBRARY}> $<INSTALL_INTERFACE:htvm::libdraco>)
else()
  htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder)
endif()

# The pictures of textures as video, and back: a library of its own, as the decoder needs none of these.
file(GLOB picture_sources CONFIGURE_DEPENDS src/texture/picture_*.cpp src/texture/vp9_*.cpp src/texture/foreseeing_*.cpp
  src/texture/thread_*.cpp)
htvm_stand_in(picture_sources VIDEO picture_coders_absent "picture_(en|de)coder|vp9_[a-z_]*|foreseeing_av1|thread_priority")
if(HTVM_VIDEO)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(HTVM_VIDEO_CODERS REQUIRED IMPORTED_TARGET aom vpx dav1d "SvtAv1Enc>=1.4" "SvtAv1Enc<3")
  htvm_floor(texture SOURCES ${picture_sources} LINKS htvm_decoder PkgConfig::HTVM_VIDEO_CODERS)
  htvm_library(texture FLOORS texture LINKS decoder NEEDS $<BUILD_INTERFACE:PkgConfig::HTVM_VIDEO_CODERS> $<INSTALL_INTERFACE:htvm::video>)
else()
  htvm_floor(texture SOURCES ${picture_sources} LINKS htvm_decoder)
endif()

# The programs: everything but their main.cpp is a library, so that tests reach it. htvm_app is what users run,
# htvm_laboratory what experiments need; both use htvm_command_line.
function(htvm_program_library name folder)
  file(GLOB sources CONFIGURE_DEPENDS apps/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  list(FILTER sources EXCLUDE REGEX "/utf8_windows\\.cpp$") # an object of the program, so that it comes before the C library
  htvm_of_system(sources)
  htvm_stand_in(sources IMAGES picture_commands_absent "picture_commands|render|still|video_output")
  htvm_stand_in(sources VIDEO video_commands_absent "video_commands|transcode|h264_pictures|picture_transcoding")
  htvm_stand_in(sources LIVE live_commands_absent "live_commands|serve|publish|link")
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
# What is left out, for --version and for who asks for it.
set(left_out "")
foreach(one ${htvm_left_out})
  string(APPEND left_out "\"${one}\", ")
endforeach()
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/abilities/left_out.cpp CONTENT "// Written by cmake/tools.cmake.
#include \"commands.h\"

namespace htvm::app {

std::vector<std::string> left_out_abilities() { return {@left_out@}; }

}  // namespace htvm::app
" @ONLY)
target_sources(htvm_app PRIVATE ${PROJECT_BINARY_DIR}/abilities/left_out.cpp)
add_executable(htvm apps/htvm/main.cpp)
target_link_libraries(htvm PRIVATE htvm_app)
if(htvm_is_whole)
  htvm_program_library(laboratory lab htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_texture htvm_texture_baking htvm_synth htvm_metrics)
  add_executable(htvm-lab apps/lab/main.cpp)
  target_link_libraries(htvm-lab PRIVATE htvm_laboratory)
endif()
if(WIN32)
  # Windows says everything in UTF-8 to a program that asks for it.
  enable_language(RC)
  target_sources(htvm PRIVATE apps/htvm/htvm.rc apps/command_line/utf8_windows.cpp)
  set_source_files_properties(apps/htvm/htvm.rc PROPERTIES OBJECT_DEPENDS ${PROJECT_SOURCE_DIR}/apps/htvm/htvm.manifest)
endif()
