# Abilities of the program htvm that a build may leave out, each with the libraries that it needs. In the place of what
# uses these stand the sources *_absent.cpp, which say so; commands of it are missing (apps/htvm/*_commands.cpp).
# htvm-lab and the tests need all of them.
set(htvm_left_out "")
macro(htvm_ability name said libraries)
  option(HTVM_${name} "Build htvm with ${said} (needs ${libraries})" ON)
  if(NOT HTVM_${name})
    list(APPEND htvm_left_out "${said}")
  endif()
endmacro()
htvm_ability(DRACO "Draco" "libdraco")
htvm_ability(IMAGES "image files" "libpng, libjpeg-turbo, libwebp")
htvm_ability(SOUND "sound" "libopus, libsndfile, libsamplerate")
htvm_ability(VIDEO "pictures of textures" "libaom, libvpx, dav1d, SVT-AV1")
htvm_ability(LIVE "live streams" "OpenSSL")
# Without it, the same is found in a longer time.
option(HTVM_EMBREE "Measure distances of surfaces by Embree" ON)
set(htvm_is_whole ON)
if(htvm_left_out OR NOT HTVM_EMBREE)
  set(htvm_is_whole OFF)
endif()

# htvm_stand_in(LIST ABILITY STAND_IN REPLACED): of these sources those that are built: all but STAND_IN with the ability,
# and all but REPLACED without; both are regular expressions of names.
function(htvm_stand_in list ability stand_in replaced)
  set(sources ${${list}})
  if(HTVM_${ability})
    list(FILTER sources EXCLUDE REGEX "/(${stand_in})\\.cpp$")
  else()
    list(FILTER sources EXCLUDE REGEX "/(${replaced})\\.cpp$")
  endif()
  set(${list} ${sources} PARENT_SCOPE)
endfunction()

# htvm_of_system(LIST): without the sources of the other system.
function(htvm_of_system list)
  set(sources ${${list}})
  foreach(source ${sources})
    string(REGEX REPLACE "_windows\\.cpp$" ".cpp" posix ${source})
    if(NOT posix STREQUAL source)
      if(WIN32)
        list(REMOVE_ITEM sources ${posix})
      else()
        list(REMOVE_ITEM sources ${source})
      endif()
    endif()
  endforeach()
  set(${list} ${sources} PARENT_SCOPE)
endfunction()
