# 64-bit Windows, by Debian's g++-mingw-w64-x86-64-posix; what is built runs here by wine64.
#   cmake -S . -B build/windows -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/x86_64-w64-mingw32.cmake -DHTVM_BUILD_TOOLS=OFF
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_FIND_ROOT_PATH /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
find_program(HTVM_WINE NAMES wine64 PATHS /usr/lib/wine) # where Debian's package wine64 puts it
set(CMAKE_CROSSCOMPILING_EMULATOR ${HTVM_WINE})
include(${CMAKE_CURRENT_LIST_DIR}/host_headers.cmake)
# A program or DLL is one file: the compiler's libraries are inside.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(CMAKE_SHARED_LINKER_FLAGS_INIT -static)
# g++ keeps 32-byte vectors on stacks that Windows aligns to 16 bytes, and moves them by instructions that fault there
# (https://gcc.gnu.org/bugzilla/show_bug.cgi?id=54412). The assembler turns these into those that do not.
set(CMAKE_CXX_FLAGS_INIT -Wa,-muse-unaligned-vector-move)
# Objects of templates have more sections than the format of old has numbers for.
string(APPEND CMAKE_CXX_FLAGS_INIT " -Wa,-mbig-obj")
