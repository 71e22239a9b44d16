# SPDX-License-Identifier: MIT
# Fails on an #include that goes against the arrows between the folders, and on a third-party library
# that is included outside the one file it is kept in.
#   cmake -D SOURCE=<checkout> -P test/layers.cmake
cmake_minimum_required(VERSION 3.24)

set(core_knows)
set(formats_knows core)
set(scenes_knows core)
set(sim_knows core)
set(registration_knows core)
set(eval_knows core formats registration)
set(reports_knows core eval)
set(cli_knows core formats scenes sim registration eval reports)

# Library: how its headers begin, and the files that may include them. Eigen is spoken everywhere; fmt
# and nlohmann-json in any .cpp.
set(libraries
  "tbb/|core/parallel.cpp" "Random123/|core/random.cpp" "yaml-cpp/|core/config.cpp"
  "lzf.h|formats/pcd.cpp" "OpenMesh/|scenes/(half_edge|foreign_mesh).cpp" "tiny_obj|scenes/foreign_mesh.cpp" "png.h|formats/png.cpp" "embree|sim/raycaster.cpp" "hwy/|(sim/vector_math|sim/phase_receiver|registration/ndt_sums|registration/kdtree_packet).cpp"
  "pcl/|registration/pcl_methods.cpp" "open3d/|registration/open3d_methods.cpp" "omp.h|registration/open3d_methods.cpp" "SQLiteCpp/|eval/store.cpp" "CLI/|cli/arguments.cpp"
  "boost/|eval/statistics.cpp" "fmt/|[a-z]+/[a-z_]+.cpp" "nlohmann/|[a-z]+/[a-z_]+.cpp")

set(broken "")
set(seen 0)
foreach(folder core formats scenes sim registration eval reports cli)
  file(GLOB sources RELATIVE ${SOURCE} ${SOURCE}/${folder}/*.h ${SOURCE}/${folder}/*.cpp)
  foreach(source ${sources})
    math(EXPR seen "${seen} + 1")
    file(STRINGS ${SOURCE}/${source} includes REGEX "^ *# *include")
    foreach(include ${includes})
      if(include MATCHES "\"([a-z]+)/")
        set(other ${CMAKE_MATCH_1})
        if(NOT other STREQUAL folder AND NOT other IN_LIST ${folder}_knows)
          string(APPEND broken "${source}: ${folder} must not know ${other}\n")
        endif()
      endif()
      foreach(library ${libraries})
        string(REGEX MATCH "^([^|]+)\\|(.+)$" ignored "${library}")
        set(header "${CMAKE_MATCH_1}")
        set(home "${CMAKE_MATCH_2}")
        if(include MATCHES "<${header}" AND NOT source MATCHES "^${home}$")
          string(APPEND broken "${source}: ${include}: only ${home} may\n")
        endif()
      endforeach()
    endforeach()
  endforeach()
endforeach()
if(seen LESS 50)
  message(FATAL_ERROR "only ${seen} sources found below ${SOURCE}")
endif()
if(broken)
  message(FATAL_ERROR "${broken}")
endif()
message(STATUS "${seen} files keep to the arrows")
