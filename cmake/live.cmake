# src/live: live streams, the web server of `htvm play` and `htvm serve`, and the player's files, which it carries inside.
find_package(Boost 1.81 REQUIRED)

if(CMAKE_CROSSCOMPILING)
  # At -O1, g++ 12 for ARM warns of uses before initialisation, and of the memory of coroutines: neither is so.
  add_compile_options(-Wno-maybe-uninitialized -Wno-mismatched-new-delete)
endif()

set(HTVM_PLAYER "" CACHE STRING
    "Folder with the built web player to carry inside the program, or OFF; empty: web/dist, if ./dev web has built it")
set(player "${HTVM_PLAYER}")
if(player STREQUAL "" AND EXISTS ${PROJECT_SOURCE_DIR}/web/dist/index.html)
  set(player ${PROJECT_SOURCE_DIR}/web/dist)
endif()
set(player_list "")
set(player_blobs "")
set(player_paths "")
if(player)
  file(GLOB player_paths CONFIGURE_DEPENDS ${player}/*)
  if(NOT EXISTS ${player}/index.html)
    message(FATAL_ERROR "HTVM_PLAYER: there is no player in ${player}; ./dev web builds one in web/dist")
  endif()
else()
  message(STATUS "Without the web player: htvm play and htvm serve have no pages. ./dev web builds it.")
endif()
set(number 0)
foreach(path ${player_paths})
  cmake_path(GET path FILENAME name)
  htvm_embed(blob player_file_${number} ${path})
  string(APPEND player_blobs "${blob}")
  string(APPEND player_list
    "    {\"${name}\", {player_file_${number}, static_cast<std::size_t>(player_file_${number}_end - player_file_${number})}},\n")
  math(EXPR number "${number} + 1")
endforeach()
set(player_cpp ${PROJECT_BINARY_DIR}/live/player_files.cpp)
file(CONFIGURE OUTPUT ${player_cpp} CONTENT "// Written by cmake/live.cmake.
#include \"live/files/player_files.h\"

#include <vector>

@player_blobs@
namespace htvm::live {

std::span<const PlayerFile> player_files() {
    static const std::vector<PlayerFile> files = {
@player_list@    };
    return files;
}

}  // namespace htvm::live
" @ONLY)
set_source_files_properties(${player_cpp} PROPERTIES OBJECT_DEPENDS "${player_paths}")
# The floors, from below: files, what any server here answers of the player's pages and of files, and the server of
# `htvm play`; client, what publishers and watchers need; hub, the streams that hubs carry; server, which connects them
# to the network.
file(GLOB live_file_sources CONFIGURE_DEPENDS src/live/files/*.cpp)
htvm_of_system(live_file_sources)
htvm_floor(live_files SOURCES ${live_file_sources} ${player_cpp} LINKS htvm_core Boost::headers nlohmann_json::nlohmann_json)
if(WIN32)
  target_link_libraries(htvm_live_files PUBLIC ws2_32 mswsock)
endif()
if(NOT HTVM_LIVE)
  htvm_floor(live_client SOURCES src/live/client/lines_absent.cpp src/live/client/hub_address.cpp src/live/hub/stream_name.cpp
    LINKS htvm_decoder)
  htvm_floor(live LINKS htvm_live_client htvm_live_files)
  return()
endif()

find_package(OpenSSL 3.0 REQUIRED)
# What joins hubs on many machines.
set(HTVM_NATS AUTO CACHE STRING "htvm serve --nats (needs libnats-dev): ON, OFF, or AUTO, which is ON where it is there")
if(HTVM_NATS)
  find_path(NATS_INCLUDE nats/nats.h)
  find_library(NATS_LIBRARY nats)
endif()
set(other_nats_source nats_peering.cpp)
set(nats_library "")
if(HTVM_NATS AND NATS_INCLUDE AND NATS_LIBRARY)
  add_library(htvm_libnats INTERFACE)
  target_include_directories(htvm_libnats SYSTEM INTERFACE ${NATS_INCLUDE})
  target_link_libraries(htvm_libnats INTERFACE ${NATS_LIBRARY})
  set(other_nats_source nats_peering_absent.cpp)
  set(nats_library htvm_libnats)
elseif(HTVM_NATS AND NOT HTVM_NATS STREQUAL "AUTO")
  message(FATAL_ERROR "HTVM_NATS: libnats-dev is not there")
endif()

file(GLOB client_sources CONFIGURE_DEPENDS src/live/client/*.cpp)
list(FILTER client_sources EXCLUDE REGEX "/lines_absent\\.cpp$")
htvm_floor(live_client SOURCES ${client_sources}
  LINKS htvm_decoder htvm_core Boost::headers OpenSSL::SSL nlohmann_json::nlohmann_json)
htvm_library(live FLOORS live_client LINKS decoder NEEDS OpenSSL::SSL)
# The same for C (htvm/htvm_live.h), by itself as all libraries for C are.
htvm_floor(c_live SOURCES src/c_api/c_live.cpp LINKS htvm_c_decoder htvm_live_client)
htvm_library(c_live C FLOORS core entropy decoder c_decoder live_client c_live NEEDS OpenSSL::SSL)
file(GLOB hub_sources CONFIGURE_DEPENDS src/live/hub/*.cpp)
list(FILTER hub_sources EXCLUDE REGEX "/${other_nats_source}$")
htvm_floor(live_hub SOURCES ${hub_sources} LINKS htvm_live_client ${nats_library})
file(GLOB server_sources CONFIGURE_DEPENDS src/live/server/*.cpp)
htvm_floor(live SOURCES ${server_sources} LINKS htvm_live_hub htvm_live_files htvm_io htvm_container)
if(HTVM_SANITIZE MATCHES "undefined" AND CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  # clang 14 cannot assemble its check of indirect calls in coroutines.
  # PUBLIC: the floors' tests have coroutines too.
  foreach(floor live_files live_client live_hub live)
    target_compile_options(htvm_${floor} PUBLIC -fno-sanitize=function)
  endforeach()
endif()
