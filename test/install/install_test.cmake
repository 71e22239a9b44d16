# SPDX-License-Identifier: MIT
# Installs the build into an empty folder, and configures, builds and runs a project that uses it.
#   cmake -D BUILD=<build folder> -D SOURCE=<this folder> -D WORK=<empty folder> -P install_test.cmake
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -D CMAKE_PREFIX_PATH=${WORK}/prefix
  -D CMAKE_BUILD_TYPE=Release -D DOCUMENT=${SOURCE}/../../docs/own_method.md)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)
run(${WORK}/prefix/bin/minescan --version)

# Both methods find their way, and the program reads what the user's own wrote.
execute_process(COMMAND ${WORK}/build/own_method WORKING_DIRECTORY ${WORK}
  OUTPUT_VARIABLE table COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK}/prefix/bin/minescan export twice.db --markdown -
  WORKING_DIRECTORY ${WORK} OUTPUT_VARIABLE exported COMMAND_ERROR_IS_FATAL ANY)
message("${exported}")
string(STRIP "${table}" table)
string(STRIP "${exported}" exported)
if(NOT table STREQUAL exported)
  message(FATAL_ERROR "the user's program wrote another table:\n${table}")
endif()
foreach(method icp icp-twice)
  if(NOT table MATCHES "\\| junction \\| ${method} \\| 1 m, 0.1 rad \\| (8|9|10) of 10 \\|")
    message(FATAL_ERROR "no line of at least 8 good trials of 10 for ${method}")
  endif()
endforeach()
