# What cpack has put together, whatever the umask of who calls it: with 077 only root could enter the installed folders.
# (CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS do not: the umask is taken from them.)
file(CHMOD_RECURSE "${CPACK_TEMPORARY_DIRECTORY}" DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
