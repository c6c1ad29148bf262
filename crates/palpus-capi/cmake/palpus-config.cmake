# find_package(palpus) from a clone: builds the library with cargo and defines the targets
# palpus::palpus (shared) and palpus::static. Needs a Rust toolchain. PALPUS_CARGO can point to another cargo.
#
#   find_package(palpus REQUIRED PATHS /path/to/palpus/crates/palpus-capi/cmake)
#   target_link_libraries(program PRIVATE palpus::palpus)
get_filename_component(_palpus_root "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
find_program(PALPUS_CARGO cargo HINTS "$ENV{HOME}/.cargo/bin")
if(NOT PALPUS_CARGO)
    set(palpus_FOUND FALSE)
    set(palpus_NOT_FOUND_MESSAGE "cargo was not found; install a Rust toolchain, or set PALPUS_CARGO")
    return()
endif()

if(NOT TARGET palpus::palpus)
    set(_palpus_target "${CMAKE_BINARY_DIR}/palpus-target")
    if(DEFINED PALPUS_TARGET_DIR)
        set(_palpus_target "${PALPUS_TARGET_DIR}")
    endif()
    if(WIN32)
        set(_palpus_shared palpus_capi.dll)
        set(_palpus_static palpus_capi.lib)
    elseif(APPLE)
        set(_palpus_shared libpalpus_capi.dylib)
        set(_palpus_static libpalpus_capi.a)
    else()
        set(_palpus_shared libpalpus_capi.so)
        set(_palpus_static libpalpus_capi.a)
    endif()
    # cargo itself decides what to rebuild.
    add_custom_target(palpus_cargo ALL
        COMMAND "${PALPUS_CARGO}" build --release -p palpus-capi --manifest-path "${_palpus_root}/Cargo.toml"
                --target-dir "${_palpus_target}"
        BYPRODUCTS "${_palpus_target}/release/${_palpus_shared}" "${_palpus_target}/release/${_palpus_static}"
        USES_TERMINAL)
    add_library(palpus::palpus SHARED IMPORTED)
    add_library(palpus::static STATIC IMPORTED)
    foreach(_palpus_library palpus static)
        set_target_properties(palpus::${_palpus_library} PROPERTIES
            INTERFACE_INCLUDE_DIRECTORIES "${_palpus_root}/include"
            IMPORTED_LOCATION "${_palpus_target}/release/${_palpus_shared}")
        add_dependencies(palpus::${_palpus_library} palpus_cargo)
    endforeach()
    set_target_properties(palpus::palpus PROPERTIES IMPORTED_NO_SONAME TRUE)
    set_target_properties(palpus::static PROPERTIES IMPORTED_LOCATION "${_palpus_target}/release/${_palpus_static}")
    if(WIN32)
        set_target_properties(palpus::palpus PROPERTIES
            IMPORTED_IMPLIB "${_palpus_target}/release/palpus_capi.dll.lib")
        target_link_libraries(palpus::static INTERFACE ws2_32 ntdll userenv)
    else()
        find_package(Threads REQUIRED)
        target_link_libraries(palpus::static INTERFACE Threads::Threads ${CMAKE_DL_LIBS} m)
    endif()
endif()
set(palpus_FOUND TRUE)
