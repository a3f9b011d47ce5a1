"""The public conformance suite: does a method keep its promises?"""
