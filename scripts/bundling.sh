# Functions of scripts/bundle and scripts/fuzz --bundle. To be sourced.

# Creates FOLDER with bin and lib. Existing content is deleted only if it is a bundle.
fresh_bundle() { # FOLDER
  if [ -n "$(ls -A "$1" 2>/dev/null)" ] && [ ! -e "$1/.jfpx-bundle" ]; then
    echo "$1 is neither empty nor a bundle; it was not changed" >&2
    exit 2
  fi
  rm -rf "$1"
  mkdir -p "$1/bin" "$1/lib"
  touch "$1/.jfpx-bundle"
}

# Copies the shared libraries that PROGRAM needs to FOLDER, except the C library with its loader, which must
# be that of the machine that runs the program.
copy_libraries() { # PROGRAM FOLDER
  ldd "$1" | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' |
    { grep -Ev '/(libc|libm|libdl|librt|libresolv|libpthread|ld-linux-x86-64)\.so' || true; } |
    while read -r library; do cp -Lu "$library" "$2/"; done
}
