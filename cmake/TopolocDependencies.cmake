# Everything beyond Eigen. What Debian packages without a CMake package is wrapped here, once.
include_guard()

find_package(PkgConfig REQUIRED)
find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs calib3d video features2d)
find_package(Ceres REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(nanoflann REQUIRED)
find_package(ZLIB REQUIRED)

add_library(opencv::opencv INTERFACE IMPORTED)
target_link_libraries(opencv::opencv INTERFACE ${OpenCV_LIBS})
target_include_directories(opencv::opencv SYSTEM INTERFACE ${OpenCV_INCLUDE_DIRS})

find_package(embree 3 REQUIRED)
add_library(embree::embree INTERFACE IMPORTED)
target_link_libraries(embree::embree INTERFACE embree)

# Video files: for topoloc-camera only, not for the vehicle process.
add_library(opencv::videoio INTERFACE IMPORTED)
target_link_libraries(opencv::videoio INTERFACE opencv_videoio)

add_library(ceres::ceres INTERFACE IMPORTED)
target_link_libraries(ceres::ceres INTERFACE Ceres::ceres)

pkg_check_modules(LCM REQUIRED IMPORTED_TARGET lcm)
add_library(lcm::lcm ALIAS PkgConfig::LCM)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
add_library(xxhash::xxhash ALIAS PkgConfig::XXHASH)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
add_library(zstd::zstd ALIAS PkgConfig::ZSTD)

# Fetched by third_party/fetch (pinned, checksummed) unless the system has them.
set(TOPOLOC_THIRD_PARTY ${CMAKE_SOURCE_DIR}/third_party/cache CACHE PATH
    "Where third_party/fetch put ONNX Runtime and LASzip")

find_path(ONNXRUNTIME_INCLUDE_DIR onnxruntime_cxx_api.h
          PATHS ${TOPOLOC_THIRD_PARTY}/onnxruntime/include
          PATH_SUFFIXES onnxruntime REQUIRED)
find_library(ONNXRUNTIME_LIBRARY NAMES onnxruntime
             PATHS ${TOPOLOC_THIRD_PARTY}/onnxruntime/lib REQUIRED)
add_library(onnxruntime::onnxruntime SHARED IMPORTED)
set_target_properties(onnxruntime::onnxruntime PROPERTIES
                      IMPORTED_LOCATION ${ONNXRUNTIME_LIBRARY}
                      INTERFACE_INCLUDE_DIRECTORIES ${ONNXRUNTIME_INCLUDE_DIR})

find_path(LASZIP_INCLUDE_DIR laszip/laszip_api.h
          PATHS ${TOPOLOC_THIRD_PARTY}/laszip/include REQUIRED)
find_library(LASZIP_LIBRARY NAMES laszip
             PATHS ${TOPOLOC_THIRD_PARTY}/laszip/lib REQUIRED)
find_library(LASZIP_API_LIBRARY NAMES laszip_api
             PATHS ${TOPOLOC_THIRD_PARTY}/laszip/lib REQUIRED)
add_library(laszip::laszip SHARED IMPORTED)
set_target_properties(laszip::laszip PROPERTIES
                      IMPORTED_LOCATION ${LASZIP_LIBRARY}
                      INTERFACE_INCLUDE_DIRECTORIES ${LASZIP_INCLUDE_DIR})
