"""jfpx for Conan 2: conan create packaging/conan -s compiler.cppstd=20"""
import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load
from conan.tools.gnu import PkgConfigDeps


class Jfpx(ConanFile):
    name = "jfpx"
    license = "Zlib"
    description = "Rigid-body collision with the same bits on the CPU, on CUDA and inside Bullet"
    topics = ("physics", "collision-detection", "deterministic", "cuda")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    # bullet: the precision of Bullet for which the adapter is built; the package then has this precision only
    options = {"shared": [True, False], "cuda": [True, False], "bullet": [False, "float", "double"]}
    default_options = {"shared": False, "cuda": False, "bullet": False}

    @property
    def _root(self):  # the recipe is inside the sources that it builds
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        text = load(self, os.path.join(self._root, "CMakeLists.txt"))
        self.version = re.search(r"project\(jfpx VERSION ([0-9.]+)", text).group(1)

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*", "src/*"):
            copy(self, pattern, self._root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        self.requires("nlohmann_json/3.11.3", visible=False)
        if self.options.bullet:
            self.requires("bullet3/3.25", transitive_headers=True, transitive_libs=True,
                          options={"double_precision": self.options.bullet == "double"})

    def validate(self):
        check_min_cppstd(self, 20)
        if self.settings.os != "Linux" or self.settings.arch not in ("x86_64", "armv8"):
            raise ConanInvalidConfiguration("jfpx supports Linux on x86-64 and ARM64 (armv8)")

    def generate(self):
        CMakeDeps(self).generate()
        PkgConfigDeps(self).generate()  # jfpx finds Bullet by pkg-config
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["JFPX_CUDA"] = "ON" if self.options.cuda else "OFF"
        toolchain.cache_variables["JFPX_BULLET"] = "ON" if self.options.bullet else "OFF"
        toolchain.cache_variables["JFPX_PRECISIONS"] = str(self.options.bullet) if self.options.bullet else "both"
        for switch in ("JFPX_MPI", "JFPX_VIEWER", "JFPX_TOOL", "JFPX_EXAMPLES", "JFPX_TESTS"):
            toolchain.cache_variables[switch] = "OFF"
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        # Consumers use the package's own CMake and pkg-config files, which contain the flags and both precisions.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.set_property("pkg_config_name", "none")
        self.cpp_info.builddirs.append(os.path.join("lib", "cmake", "jfpx"))
        self.buildenv_info.prepend_path("PKG_CONFIG_PATH", os.path.join(self.package_folder, "lib", "pkgconfig"))
