# SPDX-License-Identifier: MIT
# Third-party libraries as targets. Each is used by one .cpp of one folder (test/layers.cmake), but
# for fmt and nlohmann-json, which any .cpp may use, and Eigen.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(embree 3 QUIET)
if(NOT embree_FOUND)
  find_package(embree 4 REQUIRED)
endif()
find_package(OpenMesh REQUIRED)
find_package(SQLiteCpp REQUIRED)
find_package(CLI11 REQUIRED)
find_path(RANDOM123_INCLUDE_DIR Random123/philox.h REQUIRED)
find_path(LZF_INCLUDE_DIR lzf.h PATH_SUFFIXES liblzf REQUIRED)
find_library(LZF_LIBRARY lzf REQUIRED)
if(MINESCAN_PCL)
  # Through pkg-config: PCLConfig.cmake would look for VTK and Qt, which registration does not need.
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(PCL REQUIRED IMPORTED_TARGET pcl_registration)
endif()
