#!/usr/bin/env python3
"""Serves a folder with a page, compressed where a file has a neighbor `.gz`: what any static host does.

    serve_page.py FOLDER PORT          on this machine only
    serve_page.py FOLDER PORT --lan    on the local network too, over HTTPS with a certificate made on the spot

Browsers hand out cameras to pages over HTTPS and on localhost only. Nobody vouches for the certificate, so that the browser warns
before it shows the page; its fingerprint is printed, for comparison.
"""

import argparse
import functools
import http.server
import pathlib
import socket
import ssl
import subprocess
import sys
import tempfile


class Handler(http.server.SimpleHTTPRequestHandler):
    """Answers with the compressed neighbor of a file where there is one and the browser takes it."""

    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".wasm": "application/wasm", ".js": "text/javascript"}
    # Connections of browsers that wait, and of scanners that say nothing, end.
    timeout = 30

    def send_head(self):
        file = pathlib.Path(self.translate_path(self.path))
        compressed = file.with_name(f"{file.name}.gz")
        takes_gzip = "gzip" in self.headers.get("Accept-Encoding", "")
        if not (takes_gzip and file.is_file() and compressed.is_file()):
            return super().send_head()
        self.send_response(http.HTTPStatus.OK)
        self.send_header("Content-Type", self.guess_type(str(file)))
        self.send_header("Content-Encoding", "gzip")
        self.send_header("Content-Length", str(compressed.stat().st_size))
        self.end_headers()
        return compressed.open("rb")

    def end_headers(self):
        # A page that was just built is shown, not an older one.
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def log_message(self, *_):
        pass


class Server(http.server.ThreadingHTTPServer):
    """Shakes hands in the thread of a connection, so that a silent one keeps nobody waiting."""

    context = None

    def finish_request(self, request, client_address):
        if self.context:
            request.settimeout(Handler.timeout)
            request = self.context.wrap_socket(request, server_side=True)
        super().finish_request(request, client_address)

    def handle_error(self, request, client_address):
        # Browsers hang up, the first time because they do not know the certificate.
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


def lan_address():
    """The address of this machine in the local network. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        return probe.getsockname()[0]


def certify(address):
    """Makes a certificate for the address and localhost. Returns it for use and its fingerprint; the key is kept nowhere."""
    with tempfile.TemporaryDirectory() as folder:
        key, certificate = f"{folder}/key.pem", f"{folder}/certificate.pem"
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "30",
             "-subj", "/CN=bevy_mirrorball", "-addext", f"subjectAltName=IP:{address},IP:127.0.0.1,DNS:localhost",
             "-keyout", key, "-out", certificate],
            check=True, capture_output=True, text=True)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate, key)
        fingerprint = subprocess.run(["openssl", "x509", "-in", certificate, "-noout", "-fingerprint", "-sha256"],
                                     check=True, capture_output=True, text=True)
        return context, fingerprint.stdout.strip().split("=")[1]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("port", type=int)
    parser.add_argument("--lan", action="store_true")
    options = parser.parse_args()

    handler = functools.partial(Handler, directory=str(options.folder))
    try:
        server = Server(("0.0.0.0" if options.lan else "127.0.0.1", options.port), handler)
    except (OSError, OverflowError) as error:
        sys.exit(f"web: port {options.port} cannot be had: {error}; choose another with PORT=…")
    if options.lan:
        try:
            address = lan_address()
            server.context, fingerprint = certify(address)
        except FileNotFoundError:
            sys.exit("web: there is no openssl to make a certificate with; on Debian: apt-get install openssl")
        except subprocess.CalledProcessError as error:
            sys.exit(f"web: openssl made no certificate: {error.stderr.strip()}")
        except OSError as error:
            sys.exit(f"web: this machine is in no network: {error}")
        print(f"web: https://{address}:{options.port} on every device of this network. The browser warns, because nobody vouches for the\n"
              f"web: certificate; its SHA-256 fingerprint is {fingerprint}")
    else:
        print(f"web: http://localhost:{options.port}")
    print(f"web: the folder is {options.folder}; Ctrl+C ends", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        pass


main()
