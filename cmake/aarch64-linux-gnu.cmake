# A cross build for arm64 on Debian for amd64; packaging/README.md says which packages it needs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)

# A folder that packages for arm64 were unpacked in, where they are not installed (packaging/static).
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SPINDLE_SYSROOT)
if(SPINDLE_SYSROOT)
  set(CMAKE_SYSROOT ${SPINDLE_SYSROOT})
  # The C library that came with the compiler would be found first, and it is older.
  set(CMAKE_EXE_LINKER_FLAGS_INIT -B${SPINDLE_SYSROOT}/usr/lib/aarch64-linux-gnu)
  set(ENV{PKG_CONFIG_SYSROOT_DIR} ${SPINDLE_SYSROOT})
endif()
set(ENV{PKG_CONFIG_LIBDIR} ${SPINDLE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${SPINDLE_SYSROOT}/usr/share/pkgconfig)
