# An overlay port of the checkout that it lies in. A port in vcpkg's registry fetches a release instead:
# vcpkg_from_github(REPO, REF v${VERSION}, SHA512 of the archive). vcpkg does not see when the checkout changes: install
# with --no-binarycaching.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)
if(VCPKG_TARGET_IS_WINDOWS)
  vcpkg_check_linkage(ONLY_STATIC_LIBRARY) # DLLs of C++ would export every symbol
endif()

vcpkg_check_features(OUT_FEATURE_OPTIONS features FEATURES encoder HTVM_BUILD_ENCODER)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}"
    OPTIONS ${features} -DHTVM_BUILD_TOOLS=OFF -DHTVM_BUILD_TESTS=OFF -DHTVM_BUILD_BENCHMARKS=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME htvm CONFIG_PATH lib/cmake/htvm)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
