# What deploy/install.sh and deploy/package.sh install, below the prefix /usr. Configuration and state are the
# administrator's.
set(AXISD_PAGE ${CMAKE_SOURCE_DIR}/build/web CACHE PATH "The page of axisd-web, as npm has built it (api/web/README.md)")
if(AXISD_GRPC)
  # All that is built for it, but for the page and the Python client.
  add_custom_target(installation
                    DEPENDS axisd axisctl axisd-sim axisd-web axisd-cell axisd-link api_reference axisctl_manual)
  install(TARGETS axisd axisctl axisd-sim axisd-web axisd-cell RUNTIME DESTINATION bin)
  install(TARGETS axisd-link RUNTIME DESTINATION lib/axisd)
  install(FILES deploy/axisd.service deploy/axisd-link.service deploy/axisd-link.socket deploy/axisd-web.service
                deploy/axisd-cell.service deploy/cell/axisd-etcd.service deploy/cell/axisd-etcd-backup.service
                deploy/cell/axisd-etcd-backup.timer DESTINATION lib/systemd/system)
  install(FILES deploy/axisd.sysusers DESTINATION lib/sysusers.d RENAME axisd.conf)
  install(FILES deploy/axisd.tmpfiles DESTINATION lib/tmpfiles.d RENAME axisd.conf)
  install(FILES deploy/axisd.catalog DESTINATION lib/systemd/catalog)
  install(FILES deploy/99-axisd.rules DESTINATION lib/udev/rules.d)
  install(FILES deploy/README.md DESTINATION share/doc/axisd)
  install(DIRECTORY config/examples DESTINATION share/doc/axisd)
  install(FILES deploy/80-axisd-can.network deploy/80-axisd-can.link deploy/axisd-networks.conf
                deploy/axisd.yaml deploy/cell/cell.yaml DESTINATION share/doc/axisd/examples)
  # Whoever installs it has built it; tests that stage an installation need not.
  install(DIRECTORY ${AXISD_PAGE}/ DESTINATION share/axisd-web OPTIONAL)
  set(made ${CMAKE_BINARY_DIR}/api/axisctl)
  install(FILES ${made}/axisctl.1 deploy/man/axisd-sim.1 DESTINATION share/man/man1)
  install(FILES ${made}/axisd.yaml.5 DESTINATION share/man/man5)
  install(FILES deploy/man/axisd.8 deploy/man/axisd-link.8 deploy/man/axisd-web.8 deploy/man/axisd-cell.8
          DESTINATION share/man/man8)
  install(FILES ${made}/axisctl.bash DESTINATION share/bash-completion/completions RENAME axisctl)
  install(FILES ${made}/axisctl.fish DESTINATION share/fish/vendor_completions.d)
  # Debian's zsh does not look into site-functions below /usr.
  set(zsh site-functions)
  if(EXISTS /etc/debian_version)
    set(zsh vendor-completions)
  endif()
  install(FILES ${made}/axisctl.zsh DESTINATION share/zsh/${zsh} RENAME _axisctl)
  install(FILES ${CMAKE_BINARY_DIR}/proto/api.html ${CMAKE_BINARY_DIR}/proto/cell.html DESTINATION share/doc/axisd)
  install(FILES deploy/prometheus/axisd.rules.yml deploy/prometheus/axisd-cell.rules.yml DESTINATION share/axisd/prometheus)
  install(FILES deploy/grafana/axisd.json deploy/grafana/axisd-cell.json DESTINATION share/axisd/grafana)
  install(PROGRAMS deploy/pki.sh DESTINATION share/axisd)
  install(PROGRAMS deploy/cell/certificates.sh deploy/cell/member.sh deploy/cell/roles.sh deploy/cell/backup.sh deploy/cell/demo.sh
          DESTINATION share/axisd/cell)
  install(DIRECTORY proto/axisd DESTINATION share/axisd/proto FILES_MATCHING PATTERN "*.proto")
endif()
