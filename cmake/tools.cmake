# What the command line is made of besides the codec.
find_package(nlohmann_json 3.10 REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(PNG REQUIRED)
find_package(embree 3 REQUIRED)
find_path(DRACO_INCLUDE draco/compression/encode.h REQUIRED)
find_library(DRACO_LIBRARY draco REQUIRED)
add_library(htvm_libdraco INTERFACE)
target_include_directories(htvm_libdraco SYSTEM INTERFACE ${DRACO_INCLUDE})
target_link_libraries(htvm_libdraco INTERFACE ${DRACO_LIBRARY})

htvm_floor(io DIRECTORY src/io LINKS htvm_core htvm_libdraco nlohmann_json::nlohmann_json)
htvm_floor(synth DIRECTORY src/synth LINKS htvm_core Eigen3::Eigen)
htvm_floor(metrics DIRECTORY src/metrics LINKS htvm_core Eigen3::Eigen embree PNG::PNG)

# Draco-coded I-frames: plugs into the encoder and the decoder, which do not know libdraco.
file(GLOB draco_sources CONFIGURE_DEPENDS src/codec/*_draco.cpp)
htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder htvm_libdraco)

file(GLOB app_sources CONFIGURE_DEPENDS apps/htvm/*.cpp)
if(app_sources)
  add_executable(htvm ${app_sources})
  target_link_libraries(htvm PRIVATE htvm_encoder htvm_decoder htvm_draco htvm_io htvm_synth htvm_metrics CLI11::CLI11 fmt::fmt)
  target_compile_definitions(htvm PRIVATE HTVM_VERSION="${PROJECT_VERSION}")
  install(TARGETS htvm)
endif()
