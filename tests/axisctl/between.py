"""Between the client under test and a daemon: passes calls on as bytes, records them, and does what no real daemon does when
a test wants it: loses answers, or gives one of its own."""
import asyncio
import threading

import grpc
import grpc.aio
from google.protobuf import symbol_database

import simulated  # noqa: F401  (makes axisd importable)
from axisd.v1 import error_pb2

LONG = 3600  # s; of a deadline that nobody set

OPTIONS = (("grpc.http2.min_recv_ping_interval_without_data_ms", 900), ("grpc.http2.max_ping_strikes", 0))


async def refuse(context, code, detail, text=None):
    """Ends the call with the typed detail in the standard trailer."""
    packed = error_pb2.StatusDetails.Packed(type_url="type.googleapis.com/axisd.v1.ErrorDetail",
                                            value=detail.SerializeToString())
    details = error_pb2.StatusDetails(code=code.value[0], message=detail.message, details=[packed])
    await context.abort(code, text or detail.message, (("grpc-status-details-bin", details.SerializeToString()),))


class Open(tuple):
    """Messages of a stream that then stays open."""


class Between(grpc.GenericRpcHandler):
    """`calls`: (method, request, peer) of every call so far. `losing`: of how many calls of a method the answer is lost, after
    it was carried out. `answers`: by method, what is answered in the daemon's place: messages, an ErrorDetail that the call
    is refused with, or a function from the request to them. `open`: calls that the daemon has not ended."""

    def __init__(self, target):
        self.calls, self.losing, self.answers, self.open, self._target = [], {}, {}, [], target

    def connect(self):
        self.channel = grpc.aio.insecure_channel(self._target, options=(
            ("grpc.use_local_subchannel_pool", 1), ("grpc.enable_http_proxy", 0)))

    async def start(self, address="127.0.0.1:0"):
        """Returns the server and its port."""
        self.connect()
        server = grpc.aio.server(options=OPTIONS)
        server.add_generic_rpc_handlers((self,))
        port = server.add_insecure_port(address)
        await server.start()
        return server, port

    def requests(self, method):
        """Of one method so far."""
        return [request for name, request, _ in self.calls if name == method]

    def peers(self, method):
        return [peer for name, _, peer in self.calls if name == method]

    def service(self, details):
        async def serve(requests, context):
            async for message in self.serve(details, requests, context):
                yield message
        return grpc.stream_stream_rpc_method_handler(serve)

    async def serve(self, details, requests, context):
        service, method = details.method.strip("/").split("/")
        symbols = symbol_database.Default()
        request_type = symbols.GetPrototype(symbols.pool.FindServiceByName(service).methods_by_name[method].input_type)
        sent = await anext(aiter(requests), None)
        if sent is None:  # the client has left
            return
        request = request_type.FromString(sent)
        self.calls.append((method, request, context.peer()))
        if (answer := self.answers.get(method)) is not None:
            async for message in self._answer(answer(request) if callable(answer) else answer, context):
                yield message
            return
        async for message in self._pass_on(details, sent, context):
            if self.losing.get(method):
                self.losing[method] -= 1
                await context.abort(grpc.StatusCode.UNAVAILABLE, "the connection was cut")
            yield message

    @staticmethod
    async def _answer(answer, context):
        if not isinstance(answer, (list, tuple)):
            answer = [answer]
        for message in answer:
            if message.DESCRIPTOR.name == "ErrorDetail":
                await refuse(context, grpc.StatusCode.FAILED_PRECONDITION, message)
            yield message.SerializeToString()
        if isinstance(answer, Open):
            await asyncio.sleep(LONG)

    async def _pass_on(self, details, request, context):
        async def once():
            yield request
        left = context.time_remaining()
        passed = tuple((key, value) for key, value in details.invocation_metadata
                       if key.startswith("axisd-") and key != "axisd-machine")
        call = self.channel.stream_stream(details.method)(once(), metadata=passed,
                                                          timeout=left if left is not None and left < LONG else None)
        self.open.append(call)
        try:
            async for message in call:
                yield message
        except grpc.aio.AioRpcError as error:
            await context.abort(error.code(), error.details(), tuple(error.trailing_metadata() or ()))
        except UnboundLocalError:  # grpcio 1.51, where the client leaves while an answer is awaited
            raise asyncio.CancelledError from None
        finally:
            call.cancel()
            self.open.remove(call)


class Threaded:
    """Servers on a thread of their own. `start`: a coroutine function that returns them and the first one's port."""

    def __init__(self, start):
        self._start = start
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._main()), daemon=True)

    def __enter__(self):
        self._thread.start()
        if not self._ready.wait(60):
            raise RuntimeError("the server did not start")
        return self

    def __exit__(self, *_):
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._end.set)
            self._thread.join(30)

    async def _main(self):
        self._loop = asyncio.get_running_loop()
        self._end = asyncio.Event()
        servers, port = await self._start()
        self.address = f"127.0.0.1:{port}"
        self._ready.set()
        await self._end.wait()
        for server in servers:
            await server.stop(0)
        await self._close()

    async def _close(self):
        """What else there is to close."""

    def do(self, coroutine):
        """On the thread of the servers."""
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(60)


class Passage(Threaded):
    """A Between on a thread of its own, which is a server to the test."""

    def __init__(self, target, address="127.0.0.1:0"):
        super().__init__(self._serve)
        self._wanted = address
        self.between = Between(target)
        self.calls, self.peers = self.between.requests, self.between.peers
        self.losing, self.answers = self.between.losing, self.between.answers

    async def _serve(self):
        server, port = await self.between.start(self._wanted)
        return [server], port

    async def _close(self):
        await self.between.channel.close()
