"""The libraries for Conan 2, from the checkout that this file lies in: conan create packaging/conan --build=missing"""

import os
import re

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir


class HtvmConan(ConanFile):
    name = "htvm"
    description = "Compression of captured 3D people (human time-varying meshes): decoder, encoder and C interface"
    license = "Apache-2.0"
    topics = ("mesh", "compression", "volumetric-video")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "encoder": [True, False]}
    default_options = {"shared": False, "encoder": True}

    @property
    def project(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        header = load(self, os.path.join(self.project, "include", "htvm", "htvm.h"))
        self.version = ".".join(re.findall(r"#define HTVM_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header))

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*", "src/*"):
            copy(self, pattern, src=self.project, dst=self.export_sources_folder)

    def requirements(self):
        self.requires("tl-expected/1.1.0", transitive_headers=True)
        if self.options.encoder:
            self.requires("eigen/3.4.0", visible=False)
            self.requires("nanoflann/1.5.0", visible=False)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["HTVM_BUILD_ENCODER"] = bool(self.options.encoder)
        for off in ("HTVM_BUILD_TOOLS", "HTVM_BUILD_TESTS", "HTVM_BUILD_BENCHMARKS"):
            toolchain.cache_variables[off] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", src=self.source_folder, dst=os.path.join(self.package_folder, "licenses"))
        for folder in ("cmake", "pkgconfig"):
            rmdir(self, os.path.join(self.package_folder, "lib", folder))

    def package_info(self):
        system = ["pthread", "m"] if self.settings.os in ("Linux", "FreeBSD") else []
        libraries = {"decoder": [], "c_decoder": []}
        if self.options.encoder:
            libraries |= {"encoder": ["decoder"], "c": []}
        for name, needs in libraries.items():
            component = self.cpp_info.components[name]
            component.libs = [f"htvm_{name}"]
            component.requires = list(needs)
            component.system_libs = system
            if not name.startswith("c"):
                component.requires.append("tl-expected::tl-expected")
            component.set_property("cmake_target_name", f"htvm::{name}")
            component.set_property("pkg_config_name", f"htvm-{name.replace('_', '-')}")
