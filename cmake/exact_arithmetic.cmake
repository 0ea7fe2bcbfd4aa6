# Refuses flags under which the decoder would give different bits (docs/bitstream.md, section 1). They
# would come after, or undo, those that the project sets itself.
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
foreach(flags IN ITEMS CMAKE_CXX_FLAGS CMAKE_CXX_FLAGS_${build_type})
  if("${${flags}}" MATCHES
     "(-ffast-math|-Ofast|-ffp-contract=(fast|on)|-funsafe-math-optimizations|-fassociative-math|-freciprocal-math|-ffinite-math-only|-ffp-model=(fast|aggressive)|/fp:fast|-mfpmath=(387|both|sse,387|387,sse))")
    message(FATAL_ERROR "${flags} has ${CMAKE_MATCH_1}: streams would decode to other meshes than elsewhere. Leave it out.")
  endif()
endforeach()
