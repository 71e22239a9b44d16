# SPDX-License-Identifier: MIT
# npm and esbuild make of this folder what is built into the program: minescan_web_bundles. They work
# on a copy in the build folder, minescan_web_folder; nothing is written beside the sources.
find_program(MINESCAN_NPM npm REQUIRED)
find_program(MINESCAN_NODE node REQUIRED)

set(minescan_web_folder "${PROJECT_BINARY_DIR}/reports/web")
set(minescan_web_sources build.mjs src/element.mjs src/page.css src/page.mjs src/picture.mjs
  src/render.mjs src/scale.mjs src/spec.mjs src/tables.mjs src/text.mjs)
set(minescan_web_bundles dist/page.css dist/page.js dist/render.mjs)
list(TRANSFORM minescan_web_sources PREPEND "${CMAKE_CURRENT_LIST_DIR}/"
  OUTPUT_VARIABLE minescan_web_inputs)
list(TRANSFORM minescan_web_bundles PREPEND "${minescan_web_folder}/")
file(MAKE_DIRECTORY "${minescan_web_folder}/src" "${minescan_web_folder}/dist")

# Exactly the packages of the lock file; none of them may run a script.
add_custom_command(OUTPUT "${minescan_web_folder}/installed"
  DEPENDS "${CMAKE_CURRENT_LIST_DIR}/package.json" "${CMAKE_CURRENT_LIST_DIR}/package-lock.json"
  COMMAND ${CMAKE_COMMAND} -E copy "${CMAKE_CURRENT_LIST_DIR}/package.json"
    "${CMAKE_CURRENT_LIST_DIR}/package-lock.json" .
  COMMAND ${MINESCAN_NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
  COMMAND ${CMAKE_COMMAND} -E touch installed
  WORKING_DIRECTORY "${minescan_web_folder}"
  COMMENT "Installing the packages of reports/web" VERBATIM)

set(copies "")
foreach(source IN LISTS minescan_web_sources)
  list(APPEND copies COMMAND ${CMAKE_COMMAND} -E copy "${CMAKE_CURRENT_LIST_DIR}/${source}" "${source}")
endforeach()
add_custom_command(OUTPUT ${minescan_web_bundles}
  DEPENDS "${minescan_web_folder}/installed" ${minescan_web_inputs}
  ${copies}
  COMMAND ${MINESCAN_NODE} build.mjs
  WORKING_DIRECTORY "${minescan_web_folder}"
  COMMENT "Bundling reports/web" VERBATIM)
