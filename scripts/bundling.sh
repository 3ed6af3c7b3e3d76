# What scripts/bundle and scripts/fuzz --bundle have in common. Sourced.

# Makes FOLDER with bin and lib. What was there is thrown away only if it was a bundle.
fresh_bundle() { # FOLDER
  if [ -n "$(ls -A "$1" 2>/dev/null)" ] && [ ! -e "$1/.jfpx-bundle" ]; then
    echo "$1 is neither empty nor a bundle: it is left alone" >&2
    exit 2
  fi
  rm -rf "$1"
  mkdir -p "$1/bin" "$1/lib"
  touch "$1/.jfpx-bundle"
}

# Copies the shared libraries that PROGRAM needs into FOLDER. The C library, its loader and what belongs
# to it must be those of the machine that runs it.
copy_libraries() { # PROGRAM FOLDER
  ldd "$1" | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' |
    { grep -Ev '/(libc|libm|libdl|librt|libresolv|libpthread|ld-linux-x86-64)\.so' || true; } |
    while read -r library; do cp -Lu "$library" "$2/"; done
}
